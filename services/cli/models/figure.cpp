// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/figure.h"

#include <sys/wait.h>
#include <unistd.h>

#include "services/cli/subcommand.h"

namespace tandem::cli {

void drawFigures(const std::string& script, const std::vector<std::string>& arguments) {
  const std::string path = shareFile("experiments/" + script);
  std::vector<const char*> command{"python3", path.c_str()};
  for (const std::string& argument : arguments)
    command.push_back(argument.c_str());
  command.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    execv("/usr/bin/python3", const_cast<char* const*>(command.data()));
    _exit(127);
  }
  int status = 0;
  if (pid < 0 || waitpid(pid, &status, 0) != pid || status != 0)
    throw Failure(
        kFailure,
        "the figures could not be drawn; they need python3-matplotlib and python3-numpy: deploy/run.sh --with figures");
}

}  // namespace tandem::cli
