"""What a program acts on: the tree of frames, the arms, the hand, tools, camera and sensors of a cell."""
