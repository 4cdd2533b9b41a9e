"""The contact model ``cohesion bridge``, C++ that `walkers.runner.binary` compiles and the engine loads (README.md)."""
