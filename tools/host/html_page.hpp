// What the pages for people share: their look, and how numbers stand in them.
#pragma once

#include <string>
#include <string_view>

namespace mellin::host {

/// Escaped by its construction: whoever makes it escapes the text in it.
using Html = std::string;

/// With so many digits behind the point.
Html number(double value, int digits);

/// A card; nothing where there is no content. `title` is escaped already.
Html section(std::string_view title, const Html& content);

/// A whole page that needs no other file. Title and subtitle are escaped here.
std::string html_page(std::string_view title, std::string_view subtitle, const Html& body);

}  // namespace mellin::host
