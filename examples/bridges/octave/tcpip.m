% A stand-in for Matlab's tcpip, as much of it as KST's class uses, over Octave's instrument-control. For your own path.
classdef tcpip < handle
    properties
        TransferDelay = 'on';
        Timeout = 10;
        Status = 'closed';
    end
    properties (Access = private)
        host
        port
        link
    end
    methods
        function t = tcpip(host, port, varargin)
            t.host = host;
            t.port = port;
        end
        function fopen(t)
            t.link = tcp(t.host, t.port, -1);
            t.Status = 'open';
        end
        function fclose(t)
            tcp_close(t.link);
            t.Status = 'closed';
        end
        function fprintf(t, text)
            tcp_write(t.link, uint8([text char(10)]));  % Matlab's default format is '%s\n'
        end
        function line = fgetl(t)
            line = '';
            while true
                byte = tcp_read(t.link, 1, -1);
                if isempty(byte) || byte == 10
                    return
                end
                line(end + 1) = char(byte);
            end
        end
        function line = fgets(t)
            line = [fgetl(t) char(10)];
        end
    end
end
