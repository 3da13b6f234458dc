#include "daemon/command_line/shell_words.hpp"

#include <wordexp.h>

#include <cstddef>

namespace perimap {
namespace {

const char* reason_of(int error) noexcept {
  switch (error) {
    case WRDE_BADCHAR:
      return "expected words as in a shell, with quotes about a line's end and any of | & ; < > ( ) { }";
    case WRDE_BADVAL:
      return "expected a variable that is set";
    case WRDE_CMDSUB:
      return "expected no command in it, since none is run";
    case WRDE_SYNTAX:
      return "expected words as in a shell, found a quote or brace that does not end";
    default:
      return "could not be taken apart for want of memory";
  }
}

}  // namespace

Expected<std::vector<std::string>> split_as_a_shell(const std::string& text) {
  wordexp_t found{};
  const int error = ::wordexp(text.c_str(), &found, WRDE_NOCMD | WRDE_UNDEF);
  if (error != 0) {
    // What it had found until then is left only in that case.
    if (error == WRDE_NOSPACE) ::wordfree(&found);
    return fail(reason_of(error));
  }
  std::vector<std::string> words(found.we_wordv, found.we_wordv + found.we_wordc);
  ::wordfree(&found);
  return words;
}

}  // namespace perimap
