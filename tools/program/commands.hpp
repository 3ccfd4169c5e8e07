// The program's subcommands. Each adds itself to the command line; its callback throws std::exception where the input
// or the machine is at fault (exit status 1, the message on standard error).
#pragma once

#include <CLI/CLI.hpp>

namespace mellin::program {

void add_entropy(CLI::App& app);   ///< mellin entropy
void add_eval(CLI::App& app);      ///< mellin eval; its kinds add themselves to it, see eval.cpp
void add_map(CLI::App& app);       ///< mellin map
void add_match(CLI::App& app);     ///< mellin match
void add_optimize(CLI::App& app);  ///< mellin optimize
void add_record(CLI::App& app);    ///< mellin record
void add_score(CLI::App& app);     ///< mellin score
void add_sim(CLI::App& app);       ///< mellin sim
void add_store(CLI::App& app);     ///< mellin store

/// Kinds of `mellin eval`, added to that command.
void add_eval_cascade(CLI::App& eval);
void add_eval_change(CLI::App& eval);
void add_eval_confidence(CLI::App& eval);
void add_eval_registration(CLI::App& eval);
void add_eval_runtime(CLI::App& eval);
void add_eval_screening(CLI::App& eval);

}  // namespace mellin::program
