// The files that a command reads: it never writes over them, and a stopped job resumes only with the same contents.
#pragma once
#include <sys/stat.h>

#include <map>
#include <string>
#include <string_view>

namespace itn {

// While one lives, read_file() and those that call note_input() add to it, until end(); write_file() and
// check_writable() refuse the files as long as it lives. One at a time.
class Inputs {
 public:
  enum class Keep { names, fingerprints };
  explicit Inputs(Keep keep = Keep::names);
  ~Inputs();
  Inputs(const Inputs&) = delete;
  Inputs& operator=(const Inputs&) = delete;

  // Later reads do not count as inputs: the command reads its own state to resume from.
  void end();

  // Fingerprints by the name under which each file was read; empty without Keep::fingerprints.
  std::map<std::string, std::string> fingerprints() const;
};

// For readers that do not call read_file().
void note_input(const std::string& file, std::string_view bytes);
// For readers in another process. fingerprint: fingerprint_text() of the bytes that they read.
void note_fingerprint(const std::string& file, const std::string& fingerprint);

// For foreign libraries that read from the disk themselves: made before they do. Where fingerprints are kept, the file
// is read once more, here.
class ForeignInput {
 public:
  explicit ForeignInput(const std::string& file);
  // After they have read. Throws InputError: the file has changed since this was made.
  void note() const;

 private:
  std::string file_, fingerprint_;
  struct stat status_;
};

// Throws UsageError where the file is one of the living Inputs.
void refuse_input(const std::string& file);

}  // namespace itn
