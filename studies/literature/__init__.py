"""The second engine, the bridge laws and LIGGGHTS, compared with published numbers.

`benchmarks` compares impacts of spheres, `bridges` bridge laws, and `experiments` the motion of
walkers and beads. `checks` lists these comparisons, and that of whole runs by both engines
(`walkers.second_engine.crosscheck`).
"""
