#include "daemon/command_line/outputs.hpp"

#include "daemon/command_line/same_file.hpp"
#include "drivers/file/whole_file.hpp"

namespace perimap {

Expected<void> check_apart(const std::vector<Output>& outputs, const std::vector<Input>& inputs) {
  for (auto output = outputs.begin(); output != outputs.end(); ++output) {
    for (const Input& input : inputs) {
      if (is_same_file(output->file, input.file)) return fail(output->option + ": is " + input.name);
    }
    for (auto before = outputs.begin(); before != output; ++before) {
      if (is_same_file(output->file, before->file)) return fail(output->option + ": is the file of " + before->option);
    }
  }
  return {};
}

Expected<void> check_writable(const std::vector<Output>& outputs) {
  for (const Output& output : outputs) {
    if (output.file.empty()) continue;
    if (auto writable = check_writable(std::filesystem::path(output.file)); !writable) {
      return fail(output.option + ": " + writable.error().message);
    }
  }
  return {};
}

}  // namespace perimap
