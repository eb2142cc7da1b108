"""What measured poses and paths say of a robot's quality, by the definitions of ISO 9283; knows poses, no arms."""
