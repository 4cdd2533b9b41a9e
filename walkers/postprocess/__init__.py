"""Analysis of runs: tables, velocities, pictures, ParaView files. Reads run directories, never
starts the engine.
"""

if __name__ != "walkers.postprocess":
    raise ImportError(
        "postprocess is a link to the package walkers.postprocess: import walkers.postprocess"
    )
