// cppcoreguidelines-slicing
struct Base {
  int a = 0;
};
struct Derived : Base {
  int b = 0;
};
Base cut(const Derived& whole) { return whole; }
