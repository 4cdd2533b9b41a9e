"""What runs mean: tables, velocities, pictures, files for ParaView. Reads run directories, never starts the engine."""

from walkers.postprocess.result import read_result, tabulate
from walkers.postprocess.tables import read_table
from walkers.postprocess.trajectory import Trajectory, read_trajectory

__all__ = ["Trajectory", "read_result", "read_table", "read_trajectory", "tabulate"]
