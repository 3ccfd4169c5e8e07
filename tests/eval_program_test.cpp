// mellin eval, called as a shell does: on short drives through simulated offices.
#include <doctest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/host_support.hpp"
#include "tests/support/mellin_program.hpp"

using mellin::test::lines_of;
using mellin::test::mellin_program;
using mellin::test::Outcome;
using mellin::test::read_bytes;
using mellin::test::TemporaryFolder;

namespace {

std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out(1);
  for (const char c : line) {
    if (c == ',') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

using Row = std::map<std::string, std::string>;

/// Rows of a CSV file without quotes, by the names of its columns.
std::vector<Row> read_csv(const std::string& path) {
  const std::vector<std::string> lines = lines_of(read_bytes(path));
  REQUIRE(!lines.empty());
  const std::vector<std::string> names = fields(lines[0]);
  std::vector<Row> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> values = fields(lines[i]);
    REQUIRE(values.size() == names.size());
    Row row;
    for (std::size_t k = 0; k < names.size(); ++k) {
      row[names[k]] = values[k];
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<Row> where(const std::vector<Row>& rows, const std::string& column, const std::string& value) {
  std::vector<Row> out;
  for (const Row& row : rows) {
    if (row.at(column) == value) {
      out.push_back(row);
    }
  }
  return out;
}

double number(const Row& row, const std::string& column) { return std::stod(row.at(column)); }

/// A drive long enough for a few submaps of ten scans that meet again.
std::string simulated(const TemporaryFolder& folder, int sessions = 1) {
  const Outcome sim = mellin_program(
      folder, "sim --kind offices --path 120 --sessions " + std::to_string(sessions) + " -o " + folder.path());
  REQUIRE(sim.status == 0);
  return folder.path() + "/sim-0.log";
}

}  // namespace

TEST_SUITE("eval_program") {
  TEST_CASE("screening: tables and pictures, the same with any number of threads, better than the paper's matcher") {
    const TemporaryFolder folder;
    const std::string log = simulated(folder);
    const std::string arguments = "eval screening " + log + " --scans 20 --scales 12.5 --frames random,aligned -o ";
    const Outcome one = mellin_program(folder, arguments + folder.path() + "/one");
    REQUIRE(one.status == 0);
    CHECK(one.err.empty());  // no progress where there is no terminal
    CHECK(one.out.find("union AP") != std::string::npos);
    REQUIRE(mellin_program(folder, arguments + folder.path() + "/three --threads 3").status == 0);
    for (const char* name : {"screening.csv", "screening-curves.csv", "chosen-sim-0-random-peak.svg"}) {
      CAPTURE(name);
      CHECK(read_bytes(folder.path() + "/one/" + name).size() > 100);
      CHECK(read_bytes(folder.path() + "/one/" + name) == read_bytes(folder.path() + "/three/" + name));
    }
    const std::vector<Row> rows = where(read_csv(folder.path() + "/one/screening.csv"), "judged", "overlap");
    CHECK(rows.size() == 2 * 2 * 3);  // frames, matchers, scores
    const std::vector<Row> honest = where(where(rows, "frames", "random"), "score", "peak");
    const std::vector<Row> best = where(honest, "method", "best");
    const std::vector<Row> paper = where(honest, "method", "paper");
    REQUIRE(best.size() == 1);
    REQUIRE(paper.size() == 1);
    CHECK(number(best[0], "positives") >= 5);
    CHECK(number(best[0], "average_precision") > number(paper[0], "average_precision"));
    for (const Row& point : read_csv(folder.path() + "/one/screening-curves.csv")) {
      CHECK((number(point, "precision") >= 0.0 && number(point, "precision") <= 1.0));
      CHECK((number(point, "recall") >= 0.0 && number(point, "recall") <= 1.0));
    }
  }

  TEST_CASE("registration: errors within the limits up to the threshold, ranks rise, wrong poses are listed") {
    const TemporaryFolder folder;
    const std::string log = simulated(folder, 2);
    const std::string out = folder.path() + "/out";
    const Outcome run = mellin_program(folder, "eval registration " + log + " " + folder.path() +
                                                   "/sim-1.log --scans 20 --scales 12.5 --method best -o " + out);
    REQUIRE(run.status == 0);
    const std::vector<Row> rows = read_csv(out + "/registration.csv");
    CHECK(rows.size() == 2 * 3 * 2);  // logs, ways, populations
    for (const Row& row : rows) {
      CHECK(number(row, "max_m") <= 0.5);
      CHECK(number(row, "max_deg") <= 4.0);
      CHECK(number(row, "first_1") <= number(row, "first_2"));
      CHECK(number(row, "first_2") <= number(row, "first_6"));
    }
    CHECK(number(where(where(rows, "score", "pipeline"), "population", "positives")[0], "first_4") > 0.5);
    // The second log is judged by the threshold of the first.
    const std::vector<Row> held = read_csv(out + "/thresholds.csv");
    REQUIRE(!held.empty());
    for (const Row& row : held) {
      CHECK(row.at("log") == "sim-1");
      CHECK(row.at("threshold_of") == "sim-0");
    }
    for (const Row& row : read_csv(out + "/confusions.csv")) {
      CHECK((number(row, "metres") > 0.5 || number(row, "degrees") > 4.0));
      CHECK(!row.at("kind").empty());
    }
    CHECK(read_csv(out + "/confusion-kinds.csv").size() == 2 * 3);
    CHECK(read_bytes(out + "/chosen-sim-0-random-pipeline.svg").find("maximum") != std::string::npos);
  }

  TEST_CASE("together: sessions of one building give pairs across them") {
    const TemporaryFolder folder;
    const std::string logs = simulated(folder, 2) + " " + folder.path() + "/sim-1.log";
    const auto pairs = [&](const std::string& more) {
      const std::string out = folder.path() + "/out";
      REQUIRE(
          mellin_program(folder, "eval screening " + logs + " --scans 40 --scales 6.25 --method best -o " + out + more)
              .status == 0);
      double sum = 0.0;
      for (const Row& row : where(where(read_csv(out + "/screening.csv"), "judged", "all-by-pose"), "score", "peak")) {
        sum += number(row, "pairs");
      }
      return sum;
    };
    CHECK(pairs(" --together") > 1.5 * pairs(""));
  }

  TEST_CASE("change: a row for each share of change, fitted and checked") {
    const TemporaryFolder folder;
    const std::string out = folder.path() + "/out";
    const Outcome run =
        mellin_program(folder, "eval change --changes 0,0.5 --seeds 1 --check 2 --path 80 --pairs 24 -o " + out);
    REQUIRE(run.status == 0);
    const std::vector<Row> rows = read_csv(out + "/change.csv");
    REQUIRE(rows.size() == 4);
    const std::vector<Row> fitted = where(rows, "buildings", "fitted");
    REQUIRE(fitted.size() == 2);
    CHECK(where(rows, "buildings", "checked").size() == 2);
    CHECK(number(fitted[0], "kept_score") > number(fitted[1], "kept_score"));  // what has moved costs score
    CHECK(number(fitted[0], "law_threshold") == doctest::Approx(number(fitted[0], "kept_score")).epsilon(0.01));
    CHECK(run.out.find("* share") != std::string::npos);
    CHECK(read_bytes(out + "/change.svg").find("the law") != std::string::npos);
    CHECK(std::distance(std::filesystem::directory_iterator(out), std::filesystem::directory_iterator{}) == 2);
  }

  TEST_CASE("bad input: one line on standard error and status 1; a wrong call: 2") {
    const TemporaryFolder folder;
    const std::string log = simulated(folder);
    const std::string out = folder.path() + "/out";
    (void)folder.write("text.log", "no scans\n");
    (void)folder.write("lonely.log", read_bytes(log));
    (void)folder.write("strange.tum", "1e9 0 0 0 0 0 0 1\n");
    for (const std::string kind : {"screening ", "registration "}) {
      for (const std::string& arguments : std::vector<std::string>{
               folder.path() + "/missing.log", folder.path() + "/text.log --truth " + folder.path() + "/sim-0.tum",
               folder.path() + "/lonely.log", log + " --truth " + folder.path() + "/strange.tum",
               log + " --scans 400 --scales 6.25"}) {
        CAPTURE(arguments);
        const Outcome run = mellin_program(folder, "eval " + kind + arguments + " -o " + out);
        CHECK(run.status == 1);
        CHECK(lines_of(run.err).size() == 1);
      }
      for (const std::string& arguments : std::vector<std::string>{
               "", log, "-o " + out, log + " -o " + out + " --scales 33", log + " -o " + out + " --frames turned",
               log + " -o " + out + " --threads 0", log + " -o " + out + " --truth a.tum b.tum",
               log + " -o " + out + " --preprocessing fog"}) {
        CAPTURE(arguments);
        CHECK(mellin_program(folder, "eval " + kind + arguments).status == 2);
      }
    }
    CHECK(mellin_program(folder, "eval").status == 2);
    CHECK(mellin_program(folder, "eval nonsense").status == 2);
    CHECK(mellin_program(folder, "eval change").status == 2);
    CHECK(mellin_program(folder, "eval change -o " + out + " --changes 2").status == 2);
  }
}
