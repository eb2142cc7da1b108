"""What tests of pictures need of the machine."""

import pytest

from armwright.errors import MissingExtraError


@pytest.fixture(scope="session")
def opengl() -> str:
    """The name of the OpenGL that draws here; without one, tests of pictures are skipped with the reason."""
    pytest.importorskip("mujoco")
    from picture_worlds import TOP, photographer, world

    try:
        with photographer(world(TOP)) as taking:
            return taking.graphics
    except MissingExtraError as error:
        pytest.skip(str(error))
