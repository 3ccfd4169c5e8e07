// mellin: maps logs, registers grids, optimises pose graphs. The contract of its calls and files is in the README.
#include <cstdio>
#include <exception>

#include "program/commands.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Hierarchical 2D lidar SLAM: maps logs, registers grids, optimises pose graphs"};
  app.require_subcommand(1);
  mellin::program::add_entropy(app);
  mellin::program::add_eval(app);
  mellin::program::add_map(app);
  mellin::program::add_match(app);
  mellin::program::add_optimize(app);
  mellin::program::add_record(app);
  mellin::program::add_score(app);
  mellin::program::add_sim(app);
  mellin::program::add_store(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mellin: %s\n", error.what());
    return 1;
  }
  return 0;
}
