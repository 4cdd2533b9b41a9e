"""The contact model ``cohesion bridge``, C++ that `walkers.runner.compiled_model` compiles.

The engine loads it; README.md describes it.
"""
