"""What an arm is: joints, links, motors, limits, base, tool, gravity; read from files, kept in a catalogue."""
