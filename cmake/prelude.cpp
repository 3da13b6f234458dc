// Precompiled headers belong to a target, a library or a program, and a target needs a source.
int main() { return 0; }
