// readability-identifier-naming
int CamelCaseVariable(int Count) { return Count; }
