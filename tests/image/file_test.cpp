#include "itn/file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "itn/error.h"
#include "tests/support/temporary_folder.h"

namespace {

std::string failure(const std::string& path) {
  try {
    itn::write_file(path, "text");
  } catch (const itn::ResultError& error) {
    return error.what();
  }
  return "no ResultError";
}

// Root may write anywhere: act as an ordinary user meanwhile.
class OrdinaryUser {
 public:
  OrdinaryUser() : root_(geteuid() == 0 && seteuid(65534) == 0) {}
  ~OrdinaryUser() {
    if (root_ && seteuid(0) != 0) std::abort();
  }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;

 private:
  bool root_;
};

}  // namespace

TEST_CASE("a file is written whole, replaces the one before, and nothing else stays in the folder") {
  const TemporaryFolder folder;
  itn::write_file(folder / "a", "first");
  itn::write_file(folder / "a", std::string(100000, 'x'));
  CHECK(itn::read_file(folder / "a") == std::string(100000, 'x'));
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("a symbolic link stays a link and its target is replaced") {
  const TemporaryFolder folder;
  itn::write_file(folder / "target", "old");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  itn::write_file(folder / "link", "new");
  CHECK(std::filesystem::is_symlink(folder / "link"));
  CHECK(itn::read_file(folder / "target") == "new");
}

TEST_CASE("a missing output folder is named") {
  const TemporaryFolder folder;
  CHECK_THAT(failure(folder / "missing/a"), Catch::Contains("missing/a: cannot be written") &&
                                                Catch::Contains("create the folder " + (folder / "missing")));
  CHECK_THROWS_AS(itn::check_writable(folder / "missing/a"), itn::ResultError);
  CHECK(folder.empty());
}

TEST_CASE("a read-only output folder is refused, before the work too") {
  const TemporaryFolder folder;
  REQUIRE(chmod(folder.path().c_str(), 0555) == 0);
  const OrdinaryUser user;
  CHECK_THAT(failure(folder / "a"), Catch::Contains("choose a folder you may write to"));
  CHECK_THROWS_AS(itn::check_writable(folder / "a"), itn::ResultError);
  CHECK(folder.empty());
}

TEST_CASE("a folder as target is refused") {
  const TemporaryFolder folder;
  CHECK_THAT(failure(folder.path().string()), Catch::Contains("is a folder"));
  CHECK_THAT(failure(folder.path().string() + "/"), Catch::Contains("is a folder"));
}

TEST_CASE("a full disk is reported and the device behind the name stays what it is") {
  CHECK_THAT(failure("/dev/full"), Catch::Contains("No space left") && Catch::Contains("make room"));
  struct stat status {};
  REQUIRE(stat("/dev/full", &status) == 0);
  CHECK(S_ISCHR(status.st_mode));
}

TEST_CASE("a disk that fills up in the middle of a file leaves nothing behind") {
  const TemporaryFolder folder;
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  signal(SIGXFSZ, SIG_IGN);
  const rlimit small{10000, before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
  CHECK_THROWS_AS(itn::write_file(folder / "a", std::string(100000, 'x')), itn::ResultError);
  REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);
  CHECK(folder.empty());
}

TEST_CASE("asking whether a file can be written leaves the folder as it was") {
  const TemporaryFolder folder;
  itn::check_writable(folder / "a");
  CHECK(folder.empty());
}

TEST_CASE("reading a missing file or a folder is an input error") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(itn::read_file(folder / "a"), Catch::Contains("No such file"));
  CHECK_THROWS_AS(itn::read_file(folder.path().string()), itn::InputError);
}

TEST_CASE("pipes, devices and endless files are not read") {
  const TemporaryFolder folder;
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK_THROWS_WITH(itn::read_file(folder / "pipe"), Catch::Contains("is a pipe, a socket or a device"));
  CHECK_THROWS_WITH(itn::read_file("/dev/zero"), Catch::Contains("is a pipe, a socket or a device"));
  CHECK_THROWS_AS(itn::check_regular_file(folder / "pipe"), itn::InputError);
  CHECK_FALSE(itn::read_file("/proc/self/status").empty());  // says that it has 0 bytes
  itn::write_file(folder / "large", "");
  std::filesystem::resize_file(folder / "large", std::uintmax_t{1} << 40);
  CHECK_THROWS_WITH(itn::read_file(folder / "large"), Catch::Contains("at most"));
  itn::write_file(folder / "small", "123");
  CHECK_THROWS_AS(itn::read_file(folder / "small", 2), itn::InputError);
}

TEST_CASE("loops of links, long names and folders that may not be entered are refused, whoever asks") {
  const TemporaryFolder folder;
  std::filesystem::create_symlink(folder / "b", folder / "a");
  std::filesystem::create_symlink(folder / "a", folder / "b");
  CHECK_THROWS_WITH(itn::read_file(folder / "a"), Catch::Contains("cannot be read"));
  CHECK_THROWS_AS(itn::write_file(folder / "a/x", ""), itn::ResultError);
  CHECK(itn::is_there(folder / "a"));
  const std::string long_name(300, 'x');
  CHECK_THROWS_WITH(itn::read_file(folder / long_name), Catch::Contains("too long"));
  CHECK_THAT(failure(folder / long_name), Catch::Contains("shorter name"));
  CHECK_FALSE(itn::is_folder(folder / long_name));
  std::filesystem::create_directory(folder / "closed");
  itn::write_file(folder / "closed/x", "");
  REQUIRE(chmod((folder / "closed").c_str(), 0) == 0);
  {
    const OrdinaryUser user;
    CHECK_THROWS_WITH(itn::read_file(folder / "closed/x"), Catch::Contains("Permission denied"));
    CHECK(itn::is_there(folder / "closed/x"));
  }
  REQUIRE(chmod((folder / "closed").c_str(), 0700) == 0);
}

TEST_CASE("a name of 255 characters can be written, though its temporary name would be longer") {
  const TemporaryFolder folder;
  const std::string name(255, 'x');
  itn::write_file(folder / name, "text");
  CHECK(itn::read_file(folder / name) == "text");
}

TEST_CASE("what a killed process has left is removed, what a living one writes is not") {
  const TemporaryFolder folder;
  const std::string left = folder / "a.tmp-0123456789abcdef", other = folder / "b.tmp-0123456789abcdef",
                    own = folder / "a.tmp-notours";
  for (const std::string& file : {left, other, own}) std::ofstream(file) << "x";
  const int locked = open(other.c_str(), O_RDONLY);
  REQUIRE(flock(locked, LOCK_EX) == 0);
  itn::check_writable(folder / "a");
  CHECK_FALSE(itn::is_there(left));
  itn::remove_remains(folder.path().string());
  CHECK(itn::is_there(other));
  close(locked);
  itn::remove_remains(folder.path().string());
  CHECK_FALSE(itn::is_there(other));
  CHECK(itn::is_there(own));
}
