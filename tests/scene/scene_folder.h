// A folder for scenes written by a test.
#pragma once
#include <catch2/catch.hpp>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "itn/error.h"
#include "itn/load_scene.h"
#include "tests/support/temporary_folder.h"

class SceneFolder {
 public:
  using Definitions = std::map<std::string, std::string>;

  void write(const std::string& name, const std::string& text) {
    std::filesystem::remove(folder_ /
                            name);  // some file systems flush a file that is overwritten, which takes milliseconds
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string path(const std::string& name) const { return folder_ / name; }

  // The body stands in a <scene> of the file scene.xml from line 2 on; a sensor and a light follow where it has none.
  itn::Scene load(const std::string& body, const Definitions& definitions = {}) {
    std::string text = "<scene version=\"3.0.0\">\n" + body + "\n";
    if (body.find("<sensor") == std::string::npos) text += "<sensor type=\"perspective\"/>\n";
    if (body.find("<emitter") == std::string::npos) text += "<emitter type=\"constant\"/>\n";
    write("scene.xml", text + "</scene>\n");
    return itn::load_scene(path("scene.xml"), definitions);
  }

  // The message of the InputError that loading ends with; empty when it succeeds.
  std::string error_of(const std::string& body) {
    try {
      load(body);
    } catch (const itn::InputError& error) {
      return error.what();
    }
    return "";
  }

  // Loading fails, and the message names the file, the line and every one of the words.
  void check_error(const std::string& body, int line, const std::vector<std::string>& words) {
    INFO("scene:\n" << body);
    const std::string message = error_of(body);
    INFO("message: " << message);
    CHECK(message.rfind(path("scene.xml") + ":" + std::to_string(line) + ":", 0) == 0);
    for (const std::string& word : words) CHECK_THAT(message, Catch::Contains(word));
  }

  // An ASCII PLY file from vertices and faces, as rows of text.
  void write_ply(const std::string& name, const std::vector<std::string>& vertices,
                 const std::vector<std::string>& faces) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                       std::to_string(faces.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const std::string& row : vertices) text += row + "\n";
    for (const std::string& row : faces) text += row + "\n";
    write(name, text);
  }
  void write_tetrahedron(const std::string& name) {
    write_ply(name, {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}, {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2"});
  }

 private:
  TemporaryFolder folder_;
};
