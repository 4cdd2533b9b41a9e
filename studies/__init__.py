"""Uses of the library, run from a checkout.

They are `paper`, `literature`, `effects`, `frictions` and `article`.

A study may use all of `walkers`, and nothing in `walkers` knows a study. The wheel does not contain
them. The Makefile starts them: ``make figures``, ``make validate`` and ``make paper``.
"""
