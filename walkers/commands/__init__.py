"""The commands: the public functions of the modules of `GROUPS`, in the order of ``walkers --help``.

A function named ``check_engine`` is the command ``walkers check engine``.
"""

GROUPS = {"run": "Run", "look": "Look at results", "keep": "Keep and share", "check": "Check and calibrate"}
"""The modules, with their headings in the help."""
SECTIONS = {
    "check": "Check the engine, the contact model, one case, or files. Exit status 1 if something differs.",
    "paper": "Compare with the published results: figures and numbers.",
}
"""Commands with sub-commands, and their help."""
