// Carries the precompiled headers of the tests: they belong to a target, built as the tests are.
int main() { return 0; }
