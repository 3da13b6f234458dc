// A file that is served: part of the program, so that nothing else of the host can be asked for.
#pragma once

#include <string_view>

namespace perimap {

struct PageFile {
  std::string_view path;  // as it is asked for: "/", "/view.css"
  std::string_view type;  // media type
  std::string_view content;
};

}  // namespace perimap
