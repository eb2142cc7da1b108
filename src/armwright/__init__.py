"""A workbench for robot manipulators: model an arm, solve it, move it, program it, and know how accurate it is.

Each folder is a namespace with its functions, types and errors, imported when it is first asked for:

    import armwright as aw

    arm = aw.load_arm("puma560")
    X = aw.kinematics.forward(arm, [0.1, -0.5, 0.6, 0.2, 0.8, 0.0])
    solution = aw.kinematics.inverse(arm, X)
    recording = aw.program.run("stacking.rlo", cell="stanford_cell.toml")
"""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
