// misc-redundant-expression
bool same(int a) { return a == a; }
