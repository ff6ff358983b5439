// A session of an arm that carries signals: writes outputs, and prints what the cabinet shows.
#include <cstdio>

#include "heptarm/fri.hpp"

int main(int, char** arguments) {
    using namespace heptarm;
    Arm arm(arguments[1]);
    arm.take_control();
    FriOptions options;
    options.host = "127.0.0.1";
    options.command = wire::FriCommandMode::monitor;
    options.io = {"MediaFlange.OutputX3Pin1", "MediaFlange.InputX3Pin3"};
    Fri fri(arm, options);
    try {
        fri.write("MediaFlange.InputX3Pin3", 1);
    } catch (const std::invalid_argument& error) {
        std::printf("%s\n", error.what());
    }
    for (const double value : {1.0, 0.0}) {
        fri.write(fri.signals()[0].name, value);
        for (int i = 0; i < 2000 && fri.signals()[0].value != value; ++i)
            if (!fri.next(10.0)) return 1;
        std::printf("%s shows %g\n", fri.signals()[0].name.c_str(), fri.signals()[0].value);
    }
    fri.close();
    return 0;
}
