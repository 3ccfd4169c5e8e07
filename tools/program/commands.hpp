// The program's subcommands. Each adds itself to the command line; its callback throws std::exception where the input
// or the machine is at fault (exit status 1, the message on standard error).
#pragma once

#include <CLI/CLI.hpp>

namespace mellin::program {

/// store info|verify|dump: looks into a flash image.
void add_store(CLI::App& app);

}  // namespace mellin::program
