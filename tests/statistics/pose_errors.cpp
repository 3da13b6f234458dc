#include "goals.hpp"
namespace perimap::test {
void pose_errors(const Extent&, const HeartMesh&, GoalReport&) {}
}  // namespace perimap::test
