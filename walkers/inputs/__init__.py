"""Cases in physical units, read from TOML and validated.

They stand on the laws alone (`walkers.physics`) and know nothing of the engine's language.
"""
