"""The contact model ``cohesion bridge``, C++ that `walkers.runner.plugin` compiles and the engine loads (README.md)."""
