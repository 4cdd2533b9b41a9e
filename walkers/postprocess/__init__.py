"""Analysis of runs: tables, velocities, pictures, ParaView files. Reads run directories, never starts the engine."""
