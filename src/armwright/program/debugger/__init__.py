"""The debugger, and the Debug Adapter Protocol by which editors use it."""
