// A user of the network alone: the network that ships with the library sees an image, without OpenCL.
#include <itn/loss.h>
#include <itn/network_file.h>
#include <itn/shipped.h>

#ifdef CL_VERSION_1_0
#error "itn::network brings OpenCL along"
#endif

int main() {
  itn::Network network = itn::parse_network(itn::shipped_network(), "shipped");
  const std::vector<itn::OutputRange>& outputs = network.description().outputs;
  const std::vector<float> grey(network.image_values(), 0.1F);
  const std::vector<double> parameters = itn::parameters_of(network.forward(grey, 1), network.description());
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (!(parameters[i] > outputs[i].low && parameters[i] < outputs[i].high)) return 1;
  return parameters.size() == 3 ? 0 : 1;
}
