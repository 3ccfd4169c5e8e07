#include "host/html_page.hpp"

#include <cstdio>

#include "host/file.hpp"

namespace mellin::host {
namespace {

constexpr std::string_view kStyle = R"(<style>
:root { color-scheme: light dark; --ink: #1c2430; --soft: #5c6878; --paper: #f6f7f9; --card: #ffffff; --rule: #d8dde4;
        --accent: #1f6feb; --odometry: #97a1ae; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e8ef; --soft: #9aa6b5; --paper: #14181e; --card: #1c222b; --rule: #333c49; --accent: #6aa5ff;
          --odometry: #66717f; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1100px; margin: 0 auto; padding: 24px 16px 48px; }
h1 { font-size: 26px; margin: 8px 0 2px; } h2 { font-size: 18px; margin: 0 0 10px; }
.sub { color: var(--soft); margin: 0 0 20px; }
section { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 16px 18px; margin: 0 0 16px; overflow-x: auto; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 0 0 16px; }
.tile { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 14px; }
.tile b { display: block; font-size: 22px; font-variant-numeric: tabular-nums; } .tile span { color: var(--soft); }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(320px, 1fr)); gap: 16px; } .pair section { margin: 0; }
.pair { margin-bottom: 16px; }
table { border-collapse: collapse; width: 100%; } th, td { text-align: left; padding: 4px 10px 4px 0; border-bottom: 1px solid var(--rule); }
th { color: var(--soft); font-weight: 600; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.bar { width: 40%; } td.bar i { display: block; height: 10px; border-radius: 3px; background: var(--accent); }
figure { margin: 0; } figcaption { color: var(--soft); } img, svg { max-width: 100%; height: auto; display: block; margin: 0 auto; }
img { background: #cdcdcd; border-radius: 4px; } code { font-size: 13px; overflow-wrap: anywhere; }
.key i { display: inline-block; width: 22px; height: 4px; margin: 0 6px 3px 14px; border-radius: 2px; }
.px { image-rendering: pixelated; width: 384px; } .row { display: flex; flex-wrap: wrap; gap: 16px; }
.row figure { width: 384px; max-width: 100%; }
</style>
)";

}  // namespace

Html number(double value, int digits) {
  char text[64];
  (void)std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

Html section(std::string_view title, const Html& content) {
  return content.empty() ? "" : "<section><h2>" + std::string(title) + "</h2>\n" + content + "</section>\n";
}

std::string html_page(std::string_view title, std::string_view subtitle, const Html& body) {
  const Html name = escape_html(title);
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         name + "</title>\n" + std::string(kStyle) + "</head>\n<body><main>\n<h1>" + name + "</h1>\n<p class=\"sub\">" +
         escape_html(subtitle) + "</p>\n" + body + "</main></body></html>\n";
}

}  // namespace mellin::host
