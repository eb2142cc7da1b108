"""Files of solids and assemblies as CAD and modelling programs write them: STL, OBJ, glTF and STEP."""
