// Real logs with ground truth, end to end.
#include <doctest.h>

#include <string>

#include "host/mapping_run.hpp"
#include "host/scorer.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/host_support.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using mellin::test::kSanitized;
using mellin::test::real_data;

namespace {

struct Run {
  host::TrajectoryScore live;
  host::TrajectoryScore last;
  std::size_t scans = 0;
  std::size_t loops = 0;
  std::size_t submaps = 0;
  std::size_t components = 0;
  std::uint32_t lost = 0;
  host::RelativeError relations;
};

Run map_log(const std::string& log_path, const std::string& truth_path, const std::string& relations_path) {
  const host::Log log = host::read_carmen_log(log_path);
  Config config = micro_profile();
  const std::vector<std::uint8_t> lasers = host::add_lasers(config, log);
  port::HeapFlash flash({});
  host::MappingRun run(config, flash.flash(), {});
  run.map(log, lasers, {});
  const host::MappedSession& session = run.sessions().front();
  const std::vector<host::StampedPose> truth = host::read_tum(truth_path);
  Run result;
  result.live = host::score_trajectory(run.live_trajectory(session), truth);
  result.last = host::score_trajectory(run.final_trajectory(session), truth);
  if (!relations_path.empty()) {
    result.relations = host::score_relations(run.final_trajectory(session), host::read_relations(relations_path));
  }
  result.scans = session.scans.size();
  result.loops = run.slam().collection().statistics().pairs_accepted;
  result.submaps = run.slam().collection().size();
  result.components = run.slam().collection().graph().component_count();
  result.lost = session.lost;
  MESSAGE(log_path, ": ", result.submaps, " submaps, ", result.loops, " loops, ATE live ", result.live.ate_rmse_m,
          " m, final ", result.last.ate_rmse_m, " m, relations ", result.relations.mean_m, " m");
  return result;
}

}  // namespace

TEST_CASE("intel with the micro profile: loops are closed, and the map is right to half a metre") {
  const std::string log = real_data("intel.log.gz");
  if (log.empty() || kSanitized) {
    return;
  }
  const Run run = map_log(log, real_data("intel.tum"), real_data("intel.relations"));
  CHECK(run.scans == 4544);
  CHECK(run.last.paired >= 900);
  CHECK(run.components == 1);
  CHECK(run.lost == 0);
  CHECK(run.loops > 0);
  CHECK(run.last.ate_rmse_m < 0.5);
  CHECK(run.last.ate_rmse_m <= run.live.ate_rmse_m);
  CHECK(run.relations.count > 500);
  CHECK(run.relations.mean_m < 0.25);
}

TEST_CASE("aces with the micro profile: corridors that look alike do not mislead it") {
  const std::string log = real_data("aces.log.gz");
  if (log.empty() || kSanitized) {
    return;
  }
  const Run run = map_log(log, real_data("aces.tum"), {});
  CHECK(run.components == 1);
  CHECK(run.lost == 0);
  CHECK(run.last.paired >= 400);
  CHECK(run.last.ate_rmse_m < 0.5);
}

TEST_CASE("fr079, full of doors and people, with the nano profile's coarse cells: it never says that it is lost") {
  const std::string log_path = real_data("fr079.log.gz");
  if (log_path.empty() || kSanitized) {
    return;
  }
  const host::Log log = host::read_carmen_log(log_path);
  for (const Config& profile : {nano_profile(), desktop_profile()}) {
    Config config = profile;
    config.collection.close_loops = false;
    const std::vector<std::uint8_t> lasers = host::add_lasers(config, log);
    port::HeapFlash flash({});
    host::MappingRun run(config, flash.flash(), {});
    run.map(log, lasers, {});
    CHECK(run.slam().mapper().statistics().lost == 0);
    CHECK(run.slam().collection().graph().component_count() == 1);
  }
}
