"""Laws, plants and terms of physics in files of the user's own, in the same idiom as those that come with rtctl."""
