"""The second engine, the bridge laws and LIGGGHTS beside published numbers and exact solutions.

`benchmarks` are published impacts, `bridges` published bridge laws, and `experiments` walkers and beads of others.
`checks` lists them, with the comparison of whole runs (`walkers.second_engine.crosscheck`).
"""
