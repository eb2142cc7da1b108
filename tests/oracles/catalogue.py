"""Which arms of the catalogue a test is for: told by the beginnings of their files, which are quick to read."""

from armwright.arm.load import arm_summaries

NAMES = [each.name for each in arm_summaries()]
WITH_MASSES = [each.name for each in arm_summaries() if any("masses" in document.gives for document in each.documents)]
WITH_DRIVES = [each.name for each in arm_summaries() if any("drives" in document.gives for document in each.documents)]
SIX_JOINTS = [each.name for each in arm_summaries() if each.joints == 6]
# What `make test` draws of a test that has one case for each arm, and for each that has masses.
FEW, FEW_WITH_MASSES = 0.08, 0.25
