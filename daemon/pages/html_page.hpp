// Reports as one self-contained HTML page.
#pragma once

#include <string>

namespace perimap {

// As text of HTML and SVG, attributes included.
[[nodiscard]] std::string escaped(const std::string& text);

// A page with this title as its heading too. `body`: HTML.
[[nodiscard]] std::string html_page(const std::string& title, const std::string& body);

}  // namespace perimap
