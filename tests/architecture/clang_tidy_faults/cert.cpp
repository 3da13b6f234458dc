// cert-err34-c
#include <cstdlib>
int number(const char* text) { return std::atoi(text); }
