// modernize-use-nullptr
int* nothing() { return 0; }
