// The library's configuration by name: `key=value` on the command line and in files, and the list of all that
// summary.json shows.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host/summary.hpp"
#include "mellin/config.hpp"

namespace mellin::host {

/// The profile called desktop, micro or nano. Throws std::invalid_argument for another name.
Config profile_named(const std::string& name);

/// Sets one field. Throws std::invalid_argument where there is no such key (naming the nearest ones), or the value is
/// not of its kind or out of its range.
void apply_setting(Config& config, const std::string& key, const std::string& value);

/// The same from `key=value`.
void apply_setting(Config& config, const std::string& assignment);

/// Reads a file of `key = value` lines; # starts a comment. Throws std::runtime_error naming file and line.
void apply_settings_file(Config& config, const std::string& path);

/// All settings with their values, in a fixed order.
std::vector<std::pair<std::string, ConfigValue>> list_settings(const Config& config);

}  // namespace mellin::host
