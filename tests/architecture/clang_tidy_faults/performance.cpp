// performance-unnecessary-value-param
#include <string>
bool empty(const std::string text) { return text.empty(); }
