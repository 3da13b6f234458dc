// bugprone-integer-division
double half(int n) { return n / 2; }
