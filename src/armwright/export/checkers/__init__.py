"""Checkers: they read what a writer has written, run it on the model of the arm, and compare it with the plan.

They share no conversion with the writers, so that a misunderstanding does not prove itself.
"""
