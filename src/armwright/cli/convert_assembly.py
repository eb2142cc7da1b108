"""Frames of an assembly, as ``armwright convert`` writes them."""

from pathlib import Path

from armwright.cli.options import usage_error
from armwright.cli.output import print_json
from armwright.errors import counted, shown


def convert_assembly(path: Path, output: Path, *, as_json: bool) -> None:
    """Write the frames of an assembly, and report which have other names than their components."""
    from armwright.cell.assembly import frames_text, read_assembly_frames
    from armwright.files.output import write_file
    from armwright.program.language.words import VOCABULARIES, Standard

    if output.suffix.lower() != ".toml":
        raise usage_error("-o", f"expected a name that ends in .toml for the frames of an assembly, got {output}")
    assembly = read_assembly_frames(path, VOCABULARIES[Standard.RLO_2].reserved)
    write_file(output, frames_text(assembly, path.name))
    if as_json:
        print_json({"written": str(output), "frames": list(assembly.frames), "renamed": assembly.renamed})
        return
    print(f"{path.name}: {counted(len(assembly.frames), 'frame')} written to {output}")
    for name, component in assembly.renamed.items():
        print(f"  {name} is the component {shown(component)}")
