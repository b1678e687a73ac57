"""Control laws. One file a law, each in the idiom of rtctl.idiom; nothing here knows of boards, plants or clocks."""
