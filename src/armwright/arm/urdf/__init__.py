"""URDF, the format of ROS: elements, the tree of links and joints, and back."""
