// Calls the program as a shell does.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/host_support.hpp"

namespace mellin::test {

struct Outcome {
  int status = -1;
  std::string out;
  std::string err;
};

/// Runs `mellin ARGUMENTS`; what it prints goes through files of the folder.
inline Outcome mellin_program(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string program = (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "mellin").string();
  const std::string out = folder.path() + "/stdout";
  const std::string err = folder.path() + "/stderr";
  const int status = std::system((program + " " + arguments + " >" + out + " 2>" + err).c_str());
  return {WEXITSTATUS(status), read_bytes(out), read_bytes(err)};
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

}  // namespace mellin::test
