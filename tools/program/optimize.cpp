// mellin optimize IN.g2o -o OUT.g2o
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host/g2o.hpp"
#include "host/optimise_graph.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

struct Arguments {
  std::string in;
  std::string out;
  bool from_file = false;
  std::size_t max_fill = 0;
  OptimiserOptions options;
};

void run(const Arguments& arguments) {
  OptimiserOptions options = arguments.options;
  // False edges bend the chordal start, and the robust kernel with it.
  options.start = arguments.from_file || options.robust ? Start::current : Start::chordal;
  host::G2oGraph graph = host::read_g2o(arguments.in);
  const host::GraphRun run = host::optimise_graph(graph, options, arguments.max_fill);
  host::write_g2o(arguments.out, graph);
  const nlohmann::ordered_json json = {{"vertices", graph.ids.size()},
                                       {"edges", graph.edges.size()},
                                       {"chi2_initial", run.report.chi2_initial},
                                       {"chi2_final", run.report.chi2_final},
                                       {"iterations", run.report.iterations},
                                       {"converged", run.report.converged},
                                       {"status", to_string(run.report.status)},
                                       {"rejected", run.report.rejected},
                                       {"solver", run.report.fill_status == Status::ok ? "cholesky" : "gradients"},
                                       {"fill_blocks", run.report.fill},
                                       {"seconds", run.seconds},
                                       {"arena_bytes", run.arena_bytes}};
  std::printf("%s\n", json.dump(1).c_str());
}

}  // namespace

void add_optimize(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* const command = app.add_subcommand("optimize", "Optimises a 2D pose graph (g2o or TORO, plain or .gz)");
  command->add_option("IN", arguments->in, "graph to read")->required();
  command->add_option("-o,--output", arguments->out, "graph to write, g2o")->required();
  command->add_flag("--robust", arguments->options.robust, "robust kernel on edges between non-consecutive vertices");
  command->add_option("--robust-chi2", arguments->options.robust_chi2, "chi2 beyond which an edge is an outlier");
  command->add_flag("--from-file", arguments->from_file,
                    "start from the vertices instead of the chordal start (implied by --robust)");
  command->add_option("--max-iterations", arguments->options.max_iterations, "linear solves at most");
  command->add_option("--tolerance", arguments->options.tolerance, "relative decrease of chi2 that ends the iteration");
  command->add_option("--max-fill", arguments->max_fill, "blocks of the Cholesky factor; 0: as many as it needs");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace mellin::program
