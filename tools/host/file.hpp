// Files written whole or not at all: what a file held before survives a failure.
#pragma once

#include <string>
#include <string_view>

namespace mellin::host {

/// Writes the bytes beside `path` and renames them over it. Throws std::runtime_error where it cannot.
void write_file(const std::string& path, std::string_view bytes);

/// The text with &, <, >, " and ' escaped for HTML and SVG.
std::string escape_html(std::string_view text);

/// A field of a CSV row: quoted where it holds a comma, a quote or a line break (RFC 4180).
std::string csv_field(std::string_view text);

}  // namespace mellin::host
