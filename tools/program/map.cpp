#include "program/commands.hpp"
namespace mellin::program { void add_map(CLI::App&) {} }
