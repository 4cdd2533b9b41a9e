"""Cases in physical units, read from TOML and validated.

They stand on the laws alone (`walkers.physics`) and know nothing of the engine's language.
"""

if __name__ != "walkers.inputs":
    raise ImportError("inputs is a link to the package walkers.inputs: import walkers.inputs")
