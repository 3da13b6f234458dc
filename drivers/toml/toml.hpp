// toml++ as headers, so that the fuzzer and the sanitizers see into it, and with its internal assertions off: one of
// version 3.3 fails on a wrong file ("[(a]"), which the code behind it reports well. With NDEBUG it would become an
// assumption of the optimiser, so that has to go here too.
#pragma once

#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>
