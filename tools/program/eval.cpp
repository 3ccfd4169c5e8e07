// mellin eval: the paper's evaluation (Section V), a command a kind.
#include "program/commands.hpp"

namespace mellin::program {

void add_eval(CLI::App& app) {
  CLI::App* eval = app.add_subcommand("eval", "The paper's evaluation: curves, tables and pictures");
  eval->require_subcommand(1);
  add_eval_cascade(*eval);
  add_eval_change(*eval);
  add_eval_confidence(*eval);
  add_eval_registration(*eval);
  add_eval_runtime(*eval);
  add_eval_screening(*eval);
}

}  // namespace mellin::program
