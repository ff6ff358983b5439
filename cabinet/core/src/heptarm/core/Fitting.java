package heptarm.core;

import heptarm.wire.AttachLoad;
import heptarm.wire.AttachTool;
import heptarm.wire.DefineTool;
import heptarm.wire.Message;

/** Changes of tool and workpiece. They are made while nothing runs: a motion is planned for the load and the frame that it has. */
final class Fitting {
    private Fitting() {
    }

    static boolean concerns(Message message) {
        return message instanceof DefineTool || message instanceof AttachTool || message instanceof AttachLoad;
    }

    static void make(final Server server, final Message message) throws Refusal {
        server.executor.whileIdle(new Executor.Change() {
            public void make() throws Refusal {
                if (message instanceof DefineTool) {
                    server.rack.define(((DefineTool) message).tool, "tool.");
                } else if (message instanceof AttachTool) {
                    server.rack.attach(((AttachTool) message).name, ((AttachTool) message).frame);
                } else {
                    server.rack.load(((AttachLoad) message).load, ((AttachLoad) message).attached, "load.");
                }
            }
        });
    }
}
