"""``armwright arms``: the catalogue of arms."""

from armwright.cli.options import Json
from armwright.cli.output import print_json


def arms(as_json: Json = False) -> None:
    """List the arms of the catalogue.

    **Example:** `armwright arms`
    """
    from armwright.arm.load import arm_names, load_arm

    models = [load_arm(name) for name in arm_names()]
    if as_json:
        print_json([{"name": m.name, "joints": m.n, "title": m.title, "source": m.source} for m in models])
        return
    width = max(len(arm.name) for arm in models)
    print(f"{'name':<{width}}  joints  title")
    for arm in models:
        print(f"{arm.name:<{width}}  {arm.n:>6}  {arm.title}")
